"""Images of topics over HTTP, by the URLs of web_video_server: streams, snapshots, and a list of topics."""
