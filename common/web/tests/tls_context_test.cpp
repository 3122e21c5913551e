#include "common/web/tls_context.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>
#include <fstream>

#include "common/core/errors.hpp"
#include "common/web/tests/certificate.hpp"

namespace phantom::web {
namespace {

using test::Certificate;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string tls_refusal(const std::filesystem::path& certificate, const std::filesystem::path& key) {
  try {
    TlsContext(certificate, key);
  } catch (const std::runtime_error& problem) {
    return problem.what();
  }
  return "accepted";
}

// Tries synthetic_viewer: the certificate or its key
// Tries synthetic_viewer: such a certificate or key
TEST(TlsCertificate, WithItsKeyIsTakenAndAnythingElseRefusedByItsFile) {
  const Certificate own, other;
  EXPECT_EQ(tls_refusal(own.certificate, own.key), "accepted");
  EXPECT_THAT(tls_refusal("/nowhere.pem", own.key),
              AllOf(HasSubstr("/nowhere.pem"), HasSubstr("certificate")));
  EXPECT_THAT(tls_refusal(own.certificate, "/nowhere.pem"),
              AllOf(HasSubstr("/nowhere.pem"), HasSubstr("key")));
  EXPECT_THROW(TlsContext("/nowhere.pem", own.key), core::MissingError);
  EXPECT_THAT(tls_refusal(own.folder, own.key), HasSubstr("is no file"));
  EXPECT_THAT(tls_refusal(own.certificate, other.key),
              AllOf(HasSubstr(other.key.string() + ": is not the key of " + own.certificate.string())));
  EXPECT_THAT(tls_refusal(own.key, own.key), HasSubstr(own.key.string() + ": is no certificate"));
  EXPECT_THAT(tls_refusal(own.certificate, own.certificate), HasSubstr("0600"));
  const auto text = phantom::test::new_file("no key", ".pem");
  chmod(text.c_str(), 0600);
  EXPECT_THAT(tls_refusal(own.certificate, text), HasSubstr("is no key"));
  for (const unsigned mode : {0640U, 0604U, 0666U}) {
    chmod(own.key.c_str(), mode);
    EXPECT_THAT(tls_refusal(own.certificate, own.key), HasSubstr("0600")) << mode;
  }
}

// Tries synthetic_viewer: such a certificate or key
TEST(TlsCertificate, AKeyThatIsWeakOrHasAPassphraseIsRefusedWithTheReason) {
  const Certificate folder;
  const std::string weak = (folder.folder / "weak").string(), locked = (folder.folder / "locked").string();
  test::run_openssl("req -x509 -newkey rsa:1024 -noenc -days 9 -subj /CN=weak -out " + weak +
                    ".pem -keyout " + weak + ".key");
  EXPECT_THAT(tls_refusal(weak + ".pem", weak + ".key"), HasSubstr("ee key too small"));
  test::run_openssl("pkey -in " + folder.key.string() + " -aes256 -passout pass:secret -out " + locked);
  EXPECT_THAT(tls_refusal(folder.certificate, locked), HasSubstr("without a passphrase"));
}

// Tries synthetic_viewer: certificate expired; not valid yet
TEST(TlsCertificate, IsWarnedOfByItsDates) {
  const Certificate own;
  const TlsContext context(own.certificate, own.key);
  constexpr std::time_t kDay = 86400;
  const std::time_t now = std::time(nullptr);
  EXPECT_EQ(context.date_fault(now + 60), "");
  EXPECT_EQ(context.date_fault(now + 824 * kDay), "");
  EXPECT_THAT(context.date_fault(now + 826 * kDay), HasSubstr("has expired on 20"));
  EXPECT_THAT(context.date_fault(now - kDay), HasSubstr("is not valid before 20"));
}

}  // namespace
}  // namespace phantom::web
