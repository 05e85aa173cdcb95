"""What the queries need to know of pads: equilibria, maps, derivatives, many pads at once."""
