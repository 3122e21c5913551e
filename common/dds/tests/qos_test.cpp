#include "common/dds/endpoints/qos.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/profiles.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/dds/tests/test_network.hpp"
#include "fast_dds/endpoints.hpp"
#include "tests/support/files.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
using test::replaced;
using testing::AllOf;
using testing::HasSubstr;

/// A site's file with one profile.
std::string overrides(const std::string& profile) {
  return "<dds><profiles>" + profile + "</profiles></dds>";
}
/// One that sets an element of the QoS of master_state's writers.
std::string of_master(const std::string& element) {
  return overrides("<data_writer profile_name=\"master_state\"><qos>" + element + "</qos></data_writer>");
}

// Fast DDS keeps profiles for a process's life, so every case runs in a process of its own: a death test that
// exits with the message.
void expect_refused(const std::string& profiles, const testing::Matcher<const std::string&>& message) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto path =
      std::filesystem::temp_directory_path() / ("phantom_qos_" + std::to_string(getpid()) + ".xml");
  std::ofstream(path) << profiles;
  EXPECT_EXIT(
      {
        try {
          check_qos_profiles(path);
        } catch (const DdsError& problem) {
          std::cerr << problem.what();
          std::_Exit(2);
        }
        std::_Exit(0);
      },
      testing::ExitedWithCode(2), message);
  std::filesystem::remove(path);
}

TEST(Qos, ShippedProfilesKeepEveryTopicsContract) {
  EXPECT_NO_THROW(check_qos_profiles(PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml"));
}

TEST(Qos, ProfilesMayNameTimesAsEitherVersionDoes) {
  const std::string shipped = default_profiles();
  std::string renamed = shipped;
  for (const auto& [camel_case, snake_case] :
       {std::pair("heartbeatPeriod>", "heartbeat_period>"),
        std::pair("nackResponseDelay>", "nack_response_delay>"),
        std::pair("nackSupressionDuration>", "nack_supression_duration>"),
        std::pair("initialAcknackDelay>", "initial_acknack_delay>"),
        std::pair("heartbeatResponseDelay>", "heartbeat_response_delay>")})
    renamed = test::all_replaced(renamed, camel_case, snake_case);
  ASSERT_NE(renamed, shipped);
  EXPECT_EQ(with_names_of_this_version(renamed), with_names_of_this_version(shipped));
  EXPECT_EQ(overridden_profiles("site.xml", renamed), overridden_profiles("site.xml", shipped));
}

// Fast DDS's own times would let who joins late wait for up to 0.1 s.
TEST(Qos, ShippedReadersAskForWhatTheyMissAtOnce) {
  check_qos_profiles(PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml");
  auto* factory = edds::DomainParticipantFactory::get_instance();
  edds::DomainParticipantFactoryQos quiet;
  quiet.entity_factory().autoenable_created_entities = false;  // it opens no port
  factory->set_qos(quiet);
  auto* participant = factory->create_participant(0, edds::PARTICIPANT_QOS_DEFAULT);
  factory->set_qos(edds::DomainParticipantFactoryQos());
  ASSERT_NE(participant, nullptr);
  auto* subscriber = participant->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT);
  ASSERT_NE(subscriber, nullptr);
  int reliable = 0;
  for (const TopicDescription* topic : all_topics()) {
    auto qos = reader_qos(*subscriber, *topic);
    if (qos.reliability().kind != edds::RELIABLE_RELIABILITY_QOS) continue;
    ++reliable;
    EXPECT_TRUE(fast_dds::asks_at_once(qos)) << topic->name;
  }
  EXPECT_GT(reliable, 0);
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}

TEST(Qos, ASitesFileOverridesSingleElements) {
  const std::string none = overridden_profiles("site.xml", overrides(""));
  EXPECT_EQ(none, overridden_profiles("site.xml", default_profiles())) << "the defaults again change nothing";
  const std::string changed = overridden_profiles(
      "site.xml", overrides("<data_reader profile_name=\"mesh_chunk\"><topic><resourceLimitsQos>"
                            "<max_samples>100000</max_samples></resourceLimitsQos></topic></data_reader>"));
  EXPECT_EQ(changed, replaced(none, "<max_samples>49152</max_samples>", "<max_samples>100000</max_samples>"));
  const std::string added = overridden_profiles(
      "site.xml", overrides("<data_writer profile_name=\"percept\"><matchedSubscribersAllocation>"
                            "<maximum>9</maximum></matchedSubscribersAllocation></data_writer>"));
  EXPECT_THAT(added, HasSubstr("<maximum>9</maximum>"));
}

TEST(Qos, AProfileThatContradictsTheContractIsRefusedInWords) {
  expect_refused(of_master("<deadline><period><nanosec>30000000</nanosec></period></deadline>"),
                 AllOf(HasSubstr("'master_state' (data_writer)"), HasSubstr("deadline is 30 ms"),
                       HasSubstr("says 20 ms")));
  expect_refused(of_master("<reliability><kind>RELIABLE</kind></reliability>"),
                 AllOf(HasSubstr("master_state"), HasSubstr("reliability is RELIABLE")));
  expect_refused(of_master("<data_sharing><kind>AUTOMATIC</kind></data_sharing>"),
                 AllOf(HasSubstr("master_state"), HasSubstr("data sharing is on")));
}

TEST(Qos, AFileThatNamesNoTopicOrIsNoneIsRefused) {
  const auto refused = [](const std::string& text) {
    try {
      overridden_profiles("site.xml", text);
      return std::string();
    } catch (const DdsError& problem) {
      return std::string(problem.what());
    }
  };
  EXPECT_THAT(refused(overrides("\n<data_writer profile_name=\"precept\"/>")),
              HasSubstr("site.xml:2: QoS profiles: no topic is called 'precept'"));
  EXPECT_THAT(refused(overrides("<data_writer/>")), HasSubstr("no topic is called ''"));
  EXPECT_THAT(refused(overrides("<participant/>")), HasSubstr("<participant>; allowed: <data_writer>"));
  EXPECT_THAT(refused("<dds>\n<profiles>"), HasSubstr("site.xml:2: QoS profiles: no XML"));
  EXPECT_THAT(refused("<dds/>"), HasSubstr("no element <profiles>"));
  EXPECT_THAT(refused("<!-- -->"), HasSubstr("site.xml"));
  EXPECT_THAT(refused(""), HasSubstr("no XML"));
  EXPECT_THROW(check_qos_profiles("/nowhere/phantom.xml"), core::MissingError);
}

TEST(Qos, AFileThatWasRefusedIsReadAgain) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto path =
      std::filesystem::temp_directory_path() / ("phantom_qos_again_" + std::to_string(getpid()) + ".xml");
  EXPECT_EXIT(
      {
        std::ofstream(path) << of_master("<reliability><kind>FAIR</kind></reliability>");
        for (int i = 0; i < 2; ++i) {
          try {
            check_qos_profiles(path);
            std::cerr << "accepted; ";
          } catch (const DdsError& problem) {
            std::cerr << problem.what() << "; ";
          }
        }
        std::ofstream(path) << overrides("");
        check_qos_profiles(path);
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "the file is refused by Fast DDS.*the file is refused by Fast DDS");
  std::filesystem::remove(path);
}

// Whether a participant joins is a setting of the factory, which the check of the profiles needs otherwise.
TEST(Qos, ParticipantsOfSeveralThreadsJoinWhileProfilesAreChecked) {
  std::atomic<int> idle{0};
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) {
        const Participant participant("p", test_network());
        if (!participant.impl()->participant->is_enabled()) ++idle;
      }
    });
  }
  threads.clear();
  EXPECT_EQ(idle, 0) << "participants that never joined";
}

TEST(Qos, AnAddressThatIsNoneIsRefused) {
  auto network = test_network();
  network.initial_peers = {"the.other.host"};
  EXPECT_THROW(Participant("p", network), DdsError);
}

}  // namespace
}  // namespace phantom::dds
