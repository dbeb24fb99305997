"""tf_conversions: PyKDL's frames as tuples, messages and matrices."""
