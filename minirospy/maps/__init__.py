"""Maps: image files -> OccupancyGrid -> image files. Source: http://wiki.ros.org/map_server."""
