"""The program republish of image_transport: converts between raw, compressed and compressedDepth images.

Source: http://wiki.ros.org/image_transport, compressed_image_transport, compressed_depth_image_transport.
"""
