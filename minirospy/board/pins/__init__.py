"""The packages that `import RPi.GPIO` finds; the modules in `overlay/` are generated from them."""
