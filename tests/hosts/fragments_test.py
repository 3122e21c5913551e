#!/usr/bin/env python3
"""A network that drops what IP has fragmented, as firewalls and tunnels do: hosts find each other, the workspace arrives, the percept is felt.

fragments_test.py --bin DIR --cable EXECUTABLE
"""
import sys

from hosts import eventually, given_paths, need_rights, telling_logs
from two_sides import ADDRESSES, LIMIT_S, TwoSides

ANSWER = """import socket
end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
end.bind(("", 9999))
print("up", flush=True)
while True:
    end.sendto(b"here", end.recvfrom(65535)[1])"""
ASK = """import socket, sys
end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
end.settimeout(2)
end.sendto(bytes(int(sys.argv[2])), (sys.argv[1], 9999))
end.recv(100)"""


def main():
    given = given_paths("bin", "cable")
    need_rights()
    sides = TwoSides(given.bin, cable=given.cable)
    try:
        with telling_logs(sides.folder, 20):
            sides.site.cables["slave"].tell("fragments lost")
            # The cable does lose them: what a host sends in one piece passes, what IP fragments does not.
            answering = sides.site["slave"].start([sys.executable, "-c", ANSWER], sides.folder / "answering.txt")
            eventually(lambda: answering.log.read_text() == "up\n", LIMIT_S, "the slave's host answers")
            def gets_there(size):
                return sides.site["master"].try_run(sys.executable, "-c", ASK, ADDRESSES["slave"], size).returncode == 0
            assert gets_there("1000"), "the hosts do not reach each other"
            assert not gets_there("8000"), "the cable lets fragments pass"
            sides.start()
            sides.coupled()
            sides.percept_is_felt()
            sides.a_stop_can_be_reset()
            print("coupled, felt and reset without one fragment of IP")
    finally:
        sides.close()


if __name__ == "__main__":
    main()
