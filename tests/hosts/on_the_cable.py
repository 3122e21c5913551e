#!/usr/bin/env python3
"""What a stranger on the cable can see and send.

on_the_cable.py watch INTERFACE END         prints, once END goes by in a frame, what did before: {"frames": …, "clear": those with RTPS in them, "udp_ports": […]}
on_the_cable.py forge FROM TO PORT TEXT     a datagram from any address that one likes to name
on_the_cable.py send TO PORT TEXT           a datagram as everybody sends them
on_the_cable.py listen ADDRESS PORT         prints each datagram that comes
"""
import json
import socket
import struct
import sys


def watch(interface, end):
    cable = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    cable.bind((interface, 0))
    print("up", flush=True)
    frames = clear = 0
    ports = set()
    while end.encode() not in (frame := cable.recv(65536)):
        frames += 1
        clear += b"RTPS" in frame
        if frame[12:14] == b"\x08\x00" and frame[23] == socket.IPPROTO_UDP and not struct.unpack("!H", frame[20:22])[0] & 0x1fff:
            ports.add(struct.unpack("!H", frame[14 + 4 * (frame[14] & 15) + 2:][:2])[0])
    print(json.dumps({"frames": frames, "clear": clear, "udp_ports": sorted(ports)}), flush=True)


def forge(source, target, port, text):
    datagram = struct.pack("!4H", 40000, int(port), 8 + len(text), 0) + text.encode()
    header = struct.pack("!BBHHHBBH4s4s", 0x45, 0, 20 + len(datagram), 0, 0, 64, socket.IPPROTO_UDP, 0, socket.inet_aton(source), socket.inet_aton(target))
    socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_RAW).sendto(header + datagram, (target, 0))


def send(target, port, text):
    try:
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(text.encode(), (target, int(port)))
    except OSError as refused:  # by the firewall, or because there is no way
        print(refused)


def listen(address, port):
    socket_in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    socket_in.bind((address, int(port)))
    print(json.dumps({"topic": "up"}), flush=True)
    while True:
        print(json.dumps({"topic": socket_in.recv(65536).decode()}), flush=True)


if __name__ == "__main__":
    {"watch": watch, "forge": forge, "send": send, "listen": listen}[sys.argv[1]](*sys.argv[2:])
