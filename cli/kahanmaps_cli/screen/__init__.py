"""Tables, progress, colours and streams: everything that is written for a reader."""
