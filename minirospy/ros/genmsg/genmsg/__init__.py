"""genmsg: message and service definitions, for code generators."""
