"""The plant and an exported policy as Functional Mock-up Units: C sources after FMI 2.0."""
