"""Maps from laser scans and odometry (document, annex 7.3): simultaneous localisation and mapping."""
