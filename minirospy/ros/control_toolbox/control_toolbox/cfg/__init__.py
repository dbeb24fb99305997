"""control_toolbox's configuration for dynamic_reconfigure."""
