"""Studies of controllers; learners and evaluation import none of them."""
