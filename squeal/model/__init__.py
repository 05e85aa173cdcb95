"""The pad: parameters, mechanics, contact laws, contact states, equations of motion."""
