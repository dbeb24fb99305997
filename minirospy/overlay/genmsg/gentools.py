"""genmsg.gentools, provided by minirospy: md5sums and full texts."""

from minirospy.ros.genmsg.genmsg.gentools import compute_full_text, compute_md5, compute_md5_text

__all__ = ["compute_full_text", "compute_md5", "compute_md5_text"]
