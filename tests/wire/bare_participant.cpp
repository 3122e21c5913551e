// A participant of Fast DDS as it comes, on loopback by UDP, without any of ours: what the guard's harness
// must be able to end. Runs until its standard input ends.
//
//   bare_participant DOMAIN

#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <memory>

#include "fast_dds/transport.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  namespace edds = eprosima::fastdds::dds;
  auto udp = std::make_shared<phantom::fast_dds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto* participant = edds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<edds::DomainId_t>(std::atoi(argv[1])), qos);
  if (participant == nullptr) return 1;
  std::puts("up");
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  return 0;
}
