"""tf_conversions: converts PyKDL's frames to tuples, messages and matrices."""
