"""Images as arrays: encodings, views of messages, compression. Uses numpy; OpenCV or Pillow only if needed."""
