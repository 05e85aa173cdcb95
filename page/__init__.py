"""The live page: the integrator's own code as WebAssembly, in one HTML file. Run `make page`."""
