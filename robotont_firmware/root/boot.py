"""First thing after a reset: motors off, whatever comes next."""

from robotont_firmware import board, config

board.motors_off(config)
