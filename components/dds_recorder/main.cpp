#include "components/dds_recorder/command_line.hpp"
#include "components/dds_recorder/config.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  dds_recorder::CommandLine command_line;
  runtime::ProcessDescription description;
  description.name = "dds_recorder";
  description.summary =
      "Records topics into MCAP files, which other tools read as well, and plays them back. "
      "Never holds up what it records: what it cannot keep up with is counted and told.";
  description.details =
      "Examples:\n"
      "  dds_recorder record                            everything, into ./recordings, until Ctrl-C\n"
      "  dds_recorder record --topics '*_state' percept only these\n"
      "  dds_recorder record --on-event                 only around hit alerts, faults, "
      "`dds_recorder trigger`, SIGUSR1\n"
      "  dds_recorder info recordings                   what is in there\n"
      "  dds_recorder replay recordings --domain 7 --rate 0.5 --loop\n"
      "  dds_recorder convert recordings --from 10 --until 20 --out part.mcap\n"
      "`dds_recorder record --help` and so on tell the options of each.";
  description.add_options = [&](runtime::Command app) { command_line.add_to(app); };
  description.parameters = {dds_recorder::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) { return command_line.run(options); };
  return runtime::process_main(argc, argv, description);
}
