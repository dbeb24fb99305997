"""Images as arrays: encodings, views of messages, compression. Uses numpy, and OpenCV or Pillow only if needed."""
