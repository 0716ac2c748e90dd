"""The editor of missions on the page: text, what is wrong with it, its drawing, a try in the rig, saving."""
