#include "common/messages/ask.hpp"

#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/requester.hpp"

namespace phantom::messages {

std::optional<SensingReply> ask(const core::NetworkOptions& network, const std::string& name,
                                SensingCommand command, double timeout_s) {
  dds::Participant participant(name, network);
  Requester<SensingCommand, SensingReply> requester(participant, dds::kSensingCommand, dds::kSensingReply);
  std::optional<SensingReply> last;
  command.requester = requester_name(name);
  requester.ask(command, timeout_s, [&last](const SensingReply& reply) {
    last = reply;
    return true;
  });
  return last;
}

std::optional<WorkspaceReply> ask(const core::NetworkOptions& network, const std::string& name,
                                  WorkspaceCommand command, double timeout_s,
                                  const std::function<void(const WorkspaceReply&)>& on_accepted) {
  dds::Participant participant(name, network);
  Requester<WorkspaceCommand, WorkspaceReply> requester(participant, dds::kWorkspaceCommand,
                                                        dds::kWorkspaceReply);
  std::optional<WorkspaceReply> last;
  command.requester = requester_name(name);
  requester.ask(command, timeout_s, [&](const WorkspaceReply& reply) {
    const bool final = reply.outcome != WorkspaceOutcome::kAccepted;
    if (final) last = reply;
    if (!final && on_accepted) on_accepted(reply);
    return final;
  });
  return last;
}

}  // namespace phantom::messages
