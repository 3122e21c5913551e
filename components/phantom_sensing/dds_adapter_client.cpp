#include "components/phantom_sensing/dds_adapter_client.hpp"

#include "common/dds/requester.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"

namespace phantom::phantom_sensing {

struct CommandClient::Impl {
  explicit Impl(const core::NetworkOptions& network) : participant("phantom_sensing_command", network) {}

  dds::Participant participant;
  dds::Requester<msg::SensingCommand, msg::SensingReply> requester{participant, dds::kSensingCommand,
                                                                   dds::kSensingReply};
};

CommandClient::CommandClient(const core::NetworkOptions& network) : impl_(std::make_unique<Impl>(network)) {}
CommandClient::~CommandClient() = default;

std::optional<Answer> CommandClient::ask(const SensingRequest& request, double timeout_s) {
  std::optional<Answer> answer;
  impl_->requester.ask(to_message(request, dds::requester_name("phantom_sensing command")), timeout_s,
                       [&answer](const msg::SensingReply& reply) {
                         answer = {reply.done(), reply.message().to_string()};
                         return true;
                       });
  return answer;
}

}  // namespace phantom::phantom_sensing
