"""resource_retriever, provided by minirospy. Source: http://wiki.ros.org/resource_retriever."""

from minirospy.ros.resource_retriever.resource_retriever import (
    PACKAGE_PREFIX,
    URLError,
    get,
    get_filename,
    urlopen,
)

__all__ = ["PACKAGE_PREFIX", "URLError", "get", "get_filename", "urlopen"]
