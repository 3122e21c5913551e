"""A sample of every topic from one host to another (every_topic.cpp): to whom comes late, and after either was killed."""
import json
import subprocess

from hosts import eventually

BRICKS = 200
LIMIT_S = 180  # only bounds a failing test


class Every:
    """A sender or receiver of every topic (every_topic.cpp)."""

    def __init__(self, site, host, what):
        words = [site.programs[host] / "every_topic", "--what", what, "--deployment", site.topology, "--host", host]
        self.log = open(site.folder / f"{what}_{host}.log", "a")
        self.process = subprocess.Popen(site.hosts[host].inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True,
                                        env=site.hosts[host].environment)
        assert self.process.stdout.readline() == "up\n", f"{what} on {host} did not start"

    def told(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def kill(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        self.process.stdin.close()
        assert self.process.wait(60) == 0
        self.log.close()


def receives_everything(receiver, sent):
    """Each topic's sample as it was sent, octet by octet when it is serialised again, and all bricks."""
    def whole():
        got = receiver.told()
        return got["bricks"] == BRICKS and set(got["cdr"]) == set(sent["cdr"])
    eventually(whole, LIMIT_S, "a sample of every topic, and all bricks")
    got = receiver.told()
    for topic, cdr in sent["cdr"].items():
        assert got["cdr"][topic] == cdr, f"{topic} was sent as {cdr} and came as {got['cdr'][topic]}"


def every_topic_goes(site, of, to):
    """What `of` sends arrives at `to`, which joins late; so it does after either was killed. Returns what was sent."""
    sender = Every(site, of, "send")
    sent = sender.told()
    assert sent["bricks"] == BRICKS
    receiver = Every(site, to, "receive")
    receives_everything(receiver, sent)
    receiver.kill()
    receiver = Every(site, to, "receive")
    receives_everything(receiver, sender.told())
    sender.kill()
    before = receiver.told()["samples"]  # the new sender writes what is durable once
    sender = Every(site, of, "send")

    def missing():
        samples = receiver.told()["samples"]
        return [topic for topic in before if samples[topic] <= before[topic]]
    try:
        eventually(lambda: not missing(), LIMIT_S, "every topic from the new sender")
    except AssertionError as late:
        raise AssertionError(f"{late}; missing: {', '.join(missing())}") from None
    sent = sender.told()["cdr"]
    receiver.end()
    sender.end()
    print(f"{len(sent)} topics and {BRICKS} bricks of 30 kB from {of} to {to}: late, again after a kill of the receiver and of the sender")
    return sent
