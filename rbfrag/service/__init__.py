"""The HTTP face of the answers that the command line gives (extra `service`)."""
