"""Images as arrays: encodings, views of messages, compression. By numpy; OpenCV or Pillow where they are needed."""
