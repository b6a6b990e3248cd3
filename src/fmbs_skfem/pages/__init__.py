"""Pages for the browser: one file with a motion in it, which needs no network and no server."""
