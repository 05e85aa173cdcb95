"""Pads, brakes and rotors that documentation and tests begin from; `squeal example` writes them."""
