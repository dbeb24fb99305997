"""diff_drive_controller's configuration for dynamic_reconfigure."""
