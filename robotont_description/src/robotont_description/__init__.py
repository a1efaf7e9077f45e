"""What a person sees of Robotont: its model and its path."""
