"""The checksum of lines on the wire, four hexadecimal digits at the end: CRC-16/CCITT-FALSE."""

import binascii


def crc16(data):
    """CRC-16/CCITT-FALSE of bytes: polynomial 0x1021, initial value 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def add_checksum(packet):
    r"""The checked form, as bytes, of a plain command packet that ends with `;\\n`."""
    body = packet.rstrip("\n").encode("ascii")
    return body + b"%04X\n" % crc16(body)


def has_checksum(line):
    """Whether the last four characters of a line (ASCII, without newline), hexadecimal digits, are its checksum."""
    return crc16(line[:-4].encode("ascii")) == int(line[-4:], 16)
