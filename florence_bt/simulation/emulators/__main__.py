"""The old place of the emulated devices that run alone."""

raise SystemExit("emulated devices alone are in the checkout now: python tools/emulators create")
