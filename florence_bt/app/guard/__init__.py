"""The guard in front of every socket that a browser can reach: the page's port, and Foxglove's."""
