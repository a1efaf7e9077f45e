"""Driving by hand: which command drives, and the keyboard, gamepad and web page that send them."""
