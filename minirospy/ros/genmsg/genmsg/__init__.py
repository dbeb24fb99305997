"""genmsg: definitions of messages and services, as code generators read them."""
