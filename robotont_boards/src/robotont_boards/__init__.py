"""The official firmware of robotont's boards, as models on a virtual clock: bytes in, bytes and motors' efforts out."""
