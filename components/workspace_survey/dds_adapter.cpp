#include "components/workspace_survey/dds_adapter.hpp"

#include "common/dds/endpoint.hpp"
#include "common/dds/requester.hpp"
#include "common/messages/workspace_codec.hpp"

namespace phantom::workspace_survey {

struct WorkspaceClient::Impl {
  explicit Impl(const core::NetworkOptions& network) : participant("workspace_survey", network) {}

  std::optional<ServerWord> ask(msg::WorkspaceCommand command, double timeout_s) {
    std::optional<ServerWord> word;
    command.requester(dds::requester_name("workspace_survey").substr(0, 64));
    requester.ask(std::move(command), timeout_s, [&word](const msg::WorkspaceReply& reply) {
      if (reply.outcome() == msg::WORKSPACE_ACCEPTED) return false;
      word = {reply.outcome() == msg::WORKSPACE_DONE, reply.message().to_string(), reply.version()};
      return true;
    });
    return word;
  }

  dds::Participant participant;
  dds::Requester<msg::WorkspaceCommand, msg::WorkspaceReply> requester{participant, dds::kWorkspaceCommand,
                                                                       dds::kWorkspaceReply};
};

WorkspaceClient::WorkspaceClient(const core::NetworkOptions& network)
    : impl_(std::make_unique<Impl>(network)) {}
WorkspaceClient::~WorkspaceClient() = default;

std::optional<ServerWord> WorkspaceClient::add(const std::string& description, double timeout_s) {
  msg::WorkspaceCommand command;
  command.operation(msg::WORKSPACE_ADD);
  command.description(description);
  return impl_->ask(std::move(command), timeout_s);
}

std::optional<ServerWord> WorkspaceClient::move(const std::string& object, const geometry::Pose& X_WO,
                                                int guard_vox, double timeout_s) {
  msg::WorkspaceCommand command;
  command.operation(msg::WORKSPACE_MOVE);
  command.object(object);
  command.X_WO(messages::to_idl(X_WO));
  command.sets_guard(true);
  command.guard_vox(static_cast<std::uint16_t>(guard_vox));
  return impl_->ask(std::move(command), timeout_s);
}

}  // namespace phantom::workspace_survey
