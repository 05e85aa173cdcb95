"""One module for each family of matrix files; `squeal.io.matrix_formats` lists them."""
