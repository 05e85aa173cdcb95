"""What would stop all that grows: changes of a parameter, separation or damping of real modes."""
