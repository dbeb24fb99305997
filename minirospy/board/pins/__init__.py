"""What `import RPi.GPIO` offers; its modules in `overlay/` are generated from these."""
