"""Every ROS Python API that is emulated, one package each; `overlay/` re-exports them under ROS's names."""
