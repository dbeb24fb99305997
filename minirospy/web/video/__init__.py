"""Topics' images over HTTP, with the URLs of web_video_server: streams, snapshots, and a list of topics."""
