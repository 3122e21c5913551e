// A participant of Fast DDS that is not the project's: writes acme::Flask (flask.idl) on the topic "flask"
// ten times a second, and describes the type to who asks. Argument: DOMAIN
#include <unistd.h>

#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <memory>

#include "flaskPubSubTypes.hpp"

int main(int, char** arguments) {
  namespace edds = eprosima::fastdds::dds;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
  qos.name("foreign_owner");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto* participant = edds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<edds::DomainId_t>(std::atoi(arguments[1])), qos);
  if (participant == nullptr) return 1;
  edds::TypeSupport(new acme::FlaskPubSubType).register_type(participant, "acme::Flask");
  auto* topic = participant->create_topic("flask", "acme::Flask", edds::TOPIC_QOS_DEFAULT);
  auto* writer = participant->create_publisher(edds::PUBLISHER_QOS_DEFAULT)
                     ->create_datawriter(topic, edds::DATAWRITER_QOS_DEFAULT);
  if (writer == nullptr) return 2;
  const auto point = [](double x, double y) {
    acme::Point made;
    made.x(x);
    made.y(y);
    return made;
  };
  acme::Flask flask;
  flask.label("F-7");
  flask.lid(acme::Lid::OPEN);
  flask.corners()[0][0] = point(-1, 0.25);
  flask.corners()[1][0] = point(7, 8);
  flask.path({point(1, 2), point(3, 4), point(5, 6.5)});
  flask.count(65535);
  flask.full(true);
  for (;; usleep(100'000)) writer->write(&flask);
}
