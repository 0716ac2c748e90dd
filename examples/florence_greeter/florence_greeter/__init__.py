"""An example package for Florence BT: a skill that greets people, and a mission that uses it."""
