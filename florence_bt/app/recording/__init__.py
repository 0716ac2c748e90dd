"""Recordings of what is published: MCAP files, and the WebSocket of Foxglove for a running robot."""
