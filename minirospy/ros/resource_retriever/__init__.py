"""The ROS package resource_retriever."""
