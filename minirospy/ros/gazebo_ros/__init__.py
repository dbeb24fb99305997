"""The simulator under Gazebo's names: the node /gazebo, its programs, and a library of models and worlds."""
