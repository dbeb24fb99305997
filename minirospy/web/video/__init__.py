"""Images from topics over HTTP, with web_video_server's URLs: streams, snapshots, and a list of topics."""
