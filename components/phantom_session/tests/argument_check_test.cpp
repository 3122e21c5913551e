#include "components/phantom_session/argument_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/core/errors.hpp"
#include "tests/support/files.hpp"

namespace phantom::phantom_session {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A folder with components that are shell scripts.
class ArgumentCheck : public testing::Test {
 protected:
  PlannedProcess component(const std::string& name, const std::string& script, bool own_arguments = true) {
    const auto path = bin_ / name;
    std::ofstream(path) << "#!/bin/sh\n" << script << '\n';
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    PlannedProcess planned;
    planned.process.component = name;
    planned.process.name = "my " + name;
    planned.arguments = {"--law", "q"};
    planned.own_arguments = own_arguments;
    return planned;
  }
  const std::filesystem::path bin_ = test::new_folder();
};

TEST_F(ArgumentCheck, AsksWithTheArgumentsThatItWillGet) {
  const auto seen = (bin_ / "seen").string();
  const auto planned = component("master_io", "echo \"$@\" > " + seen);
  EXPECT_NO_THROW(check_arguments({planned}, bin_));
  std::ifstream file(seen);
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "--check --law q");
}

// Tries phantom_session: a component refuses … is missing
TEST_F(ArgumentCheck, ARefusalIsToldInTheComponentsWordsByItsKind) {
  const std::string speak = "echo some notice; echo '--law: q not in {pf}' >&2; echo 'Run with --help' >&2; ";
  EXPECT_THAT([&] { check_arguments({component("a", speak + "exit 2")}, bin_); },
              ThrowsMessage<core::ConfigError>("my a: --law: q not in {pf}"));
  EXPECT_THAT([&] { check_arguments({component("b", "echo b: no gamepad; exit 3")}, bin_); },
              ThrowsMessage<core::MissingError>("my b: no gamepad"));
  EXPECT_THAT([&] { check_arguments({component("c", "kill -9 $$")}, bin_); },
              ThrowsMessage<std::runtime_error>(HasSubstr("ended with code 137")));
}

TEST_F(ArgumentCheck, WhoGetsTheCommonArgumentsOnlyIsNotAsked) {
  EXPECT_NO_THROW(check_arguments({component("a", "exit 2", false)}, bin_));
}

// A check of the topology is one of all its processes, with what each warns of.
TEST_F(ArgumentCheck, AllProcessesAreCheckedAndEachLineIsToldOnce) {
  std::ostringstream out;
  const auto quiet = component("a", "echo 'mesh x: millimetres are assumed'; exit 0", false);
  const auto other = component("b", "echo 'mesh x: millimetres are assumed'; echo 'b: fine'; exit 0", false);
  EXPECT_NO_THROW(check_all({quiet, other}, bin_, out));
  EXPECT_EQ(out.str(), "my a: mesh x: millimetres are assumed\nmy b: b: fine\n");
  const auto missing = component("c", "echo 'c: can0 is not there'; exit 3", false);
  const auto wrong = component("d", "echo 'd: cell.yaml:4: hold: no such arm'; exit 2", false);
  EXPECT_THAT(
      [&] {
        check_all({quiet, missing, wrong, other}, bin_, out);
      },
      ThrowsMessage<core::ConfigError>("my c: can0 is not there\nmy d: cell.yaml:4: hold: no such arm"));
  EXPECT_THAT([&] { check_all({missing}, bin_, out); }, ThrowsMessage<core::MissingError>(HasSubstr("can0")));
}

// A topology of several hosts: what is wrong in its files is refused; devices of other hosts are not here.
TEST_F(ArgumentCheck, WhatIsMissingOnAnotherHostIsNamedAndNotRefused) {
  std::ostringstream out;
  const auto missing = component("c", "echo 'c: can0 is not there'; exit 3", false);
  const auto wrong = component("d", "echo 'd: cell.yaml:4: hold: no such arm'; exit 2", false);
  EXPECT_NO_THROW(check_all({missing}, bin_, out, Checked::kElsewhere));
  EXPECT_EQ(out.str(),
            "my c: c: can0 is not there\nmy c: missing where this check runs; its own host may have it\n");
  EXPECT_THAT(
      [&] {
        check_all({missing, wrong}, bin_, out, Checked::kElsewhere);
      },
      ThrowsMessage<core::ConfigError>("my d: cell.yaml:4: hold: no such arm"));
}

// Tries phantom_session: an executable is missing
TEST_F(ArgumentCheck, AComponentThatIsNotThereIsMissing) {
  PlannedProcess planned;
  planned.process.component = "nowhere";
  planned.own_arguments = true;
  EXPECT_THAT([&] { check_arguments({planned}, bin_); },
              ThrowsMessage<core::MissingError>(HasSubstr("nowhere: no such executable")));
}

}  // namespace
}  // namespace phantom::phantom_session
