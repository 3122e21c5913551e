#include "components/dds_spy/request.hpp"

#include "components/dds_spy/events.hpp"

namespace phantom::dds_spy {

void add_options(runtime::Command app, Request& request) {
  // A list option takes one value each time, because the next argument may be a topic.
  const auto list = [](runtime::Command of, const char* name, std::vector<std::string>& values,
                       const std::string& summary) {
    return of.option(name, values, summary).one_value_each_time();
  };
  app.option("--seconds", request.seconds, "how long to look or listen; 0: until Ctrl-C").between(0.0, 1e9);
  app.flag("--json", request.json, "JSON: one object a line");
  list(app, "--instance", request.instances,
       "echo, hz: only instances of which the key, or a part of it, is like PATTERN, e.g. 'id=3' or "
       "'component_name=slave_*'");
  list(app, "--writer", request.writers,
       "only samples of participants with a name like PATTERN, e.g. slave_io");
  app.flag("--reliable", request.reliable, "ask writers to send lost samples again, where they offer that");
  app.flag("--history", request.history,
           "also what writers keep for late joiners (asks reliably, where they offer that)");
  app.flag("--ask-types", request.ask_types,
           "ask the owners of types that are not the project's to describe them, and decode those (with Fast "
           "DDS 3)");
  app.option("--interval", request.interval_s, "hz, latency: print every so many seconds, too")
      .between(0.1, 1e6);
  const auto sub = [&](const char* name, const char* summary, Command command) {
    runtime::Command added = app.subcommand(name, summary);
    added.on_use([&request, command] { request.command = command; });
    if (command != Command::kTypes)
      added.option("topics", request.topics,
                   "names or patterns (* ? [ab]; !PATTERN takes away); none: every topic");
    return added;
  };
  sub("live", "a view that refreshes: rates, latency, events, topology, QoS; what dds_spy alone does",
      Command::kLive);
  sub("topology", "hosts, processes, topics with types, writers and readers", Command::kTopology);
  runtime::Command echo = sub("echo", "samples, decoded", Command::kEcho);
  echo.option("--count", request.count, "end after so many samples");
  echo.option("--every", request.every_s, "at most one sample of a writer in so many seconds")
      .between(0.0, 1e6);
  echo.flag("--all-octets", request.all_octets, "sequences of octets whole, not their first 32");
  sub("hz", "rate, period, jitter, sequence gaps and size of each writer's samples", Command::kRates);
  sub("latency", "age of samples on arrival", Command::kLatency);
  sub("qos", "QoS of every endpoint, mismatches explained", Command::kQos);
  runtime::Command events =
      sub("events", "joins, losses, gaps, missed deadlines, lost liveliness, mismatches, as they happen",
          Command::kEvents);
  list(events, "--kind", request.kinds, "only these kinds").one_of(event_kind_names());
  sub("types", "the project's types as IDL (no DDS)", Command::kTypes)
      .option("types", request.topics, "names or patterns, e.g. '*Percept'; none: every topic's");
  app.require_subcommand(0, 1);
}

std::string help_text() {
  return "Joins the deployment's domain as one more participant, looks and listens. "
         "Its readers are best effort and volatile:\n"
         "no writer waits for it or repeats anything for it, unless --reliable or --history ask for that.\n"
         "\n"
         "Examples:\n"
         "  dds_spy                                   live view; 1–5 switch pages, / filters, q quits\n"
         "  dds_spy topology --domain 42              who is there, on which host, in which process\n"
         "  dds_spy echo percept --every 0.5          what the phantom feels, twice a second\n"
         "  dds_spy echo workspace_object --history --count 4 --json | jq .sample.name\n"
         "  dds_spy echo component_status --instance 'component_name=master_io*'\n"
         "  dds_spy hz '*_state' drag_field --seconds 10\n"
         "  dds_spy latency master_state --seconds 60 --interval 5\n"
         "  dds_spy qos                               every mismatch: "
         "what is offered, what requested, what to do\n"
         "  dds_spy events --kind deadline_missed --kind liveliness_lost --json\n"
         "  dds_spy types phantom::msg::Percept\n"
         "Samples of types that are not the project's are counted and measured, and shown as octets, "
         "unless --ask-types\nfinds out what they are.\n";
}

Reading reading_of(const Request& request) {
  Reading reading;
  reading.read_topics = request.command != Command::kTopology && request.command != Command::kQos;
  reading.topics = diagnostics::NameFilter(request.topics);
  reading.instances = diagnostics::NameFilter(request.instances);
  reading.writers = diagnostics::NameFilter(request.writers);
  reading.options = {request.reliable, request.history};
  reading.ask_types = request.ask_types;
  if (request.all_octets) reading.decode.most_octets = 0;
  return reading;
}

}  // namespace phantom::dds_spy
