"""Interface definitions: .msg/.srv/.action text -> spec -> Python source -> class. Pure."""
