"""image_transport: its program republish, between raw, compressed and compressedDepth images.

Source: http://wiki.ros.org/image_transport, compressed_image_transport, compressed_depth_image_transport.
"""
