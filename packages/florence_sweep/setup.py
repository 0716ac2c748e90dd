"""For colcon, which builds Python packages through this file. What it can read there is in pyproject.toml."""

from setuptools import setup

setup(
    python_requires=">=3.11,<3.13",
    license="Apache-2.0",
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/florence_sweep"]),
        ("share/florence_sweep", ["package.xml"]),
    ],
)
