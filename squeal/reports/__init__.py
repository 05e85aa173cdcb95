"""One page to show: what a report finds, in sentences, and the HTML file that is made of it."""
