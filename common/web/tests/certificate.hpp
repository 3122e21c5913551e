#pragma once

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/support/files.hpp"

namespace phantom::web::test {

using phantom::test::new_folder;

inline void run_openssl(const std::string& arguments) {
  const std::string command = "openssl " + arguments + " 2> /dev/null";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
}

/// A certificate for this host, signed by itself or by another one, made as the README says.
struct Certificate {
  std::filesystem::path folder = new_folder(), certificate = folder / "certificate.pem",
                        key = folder / "key.pem";

  explicit Certificate(const std::string& name = "localhost", const Certificate* authority = nullptr) {
    const std::string signed_by = authority == nullptr ? ""
                                                       : " -CA " + authority->certificate.string() +
                                                             " -CAkey " + authority->key.string();
    run_openssl("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc -days 825 -subj /CN=" + name +
                " -addext subjectAltName=DNS:localhost,IP:127.0.0.1 -out " + certificate.string() +
                " -keyout " + key.string() + signed_by);
    chmod(key.c_str(), 0600);
  }
};

}  // namespace phantom::web::test
