// SPDX-License-Identifier: Apache-2.0
#include "server/net/tls.h"

#include <openssl/ssl.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "server/net/server.h"

namespace scolopax::net {
namespace {

namespace ssl = boost::asio::ssl;

/// Checked here because OpenSSL's message does not say that a file is missing.
void requireReadable(const std::string& what, const std::string& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (in && in.peek() != std::ifstream::traits_type::eof()) return;
  throw NetError(what + " " + file + ": cannot be read: " +
                 (errno != 0 ? std::generic_category().message(errno) : "it is empty"));
}

}  // namespace

std::unique_ptr<ssl::context> loadTls(const std::string& certificateFile, const std::string& keyFile) {
  if (certificateFile.empty() && keyFile.empty()) return nullptr;
  requireReadable("certificate", certificateFile);
  requireReadable("private key", keyFile);
  auto context = std::make_unique<ssl::context>(ssl::context::tls_server);
  context->set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
  SSL_CTX_set_mode(context->native_handle(), SSL_MODE_RELEASE_BUFFERS);
  boost::system::error_code error;
  // Refuses a key with a password, for which OpenSSL would ask on the terminal.
  context->set_password_callback([](std::size_t, ssl::context::password_purpose) { return std::string(); });
  context->use_certificate_chain_file(certificateFile, error);
  if (error)
    throw NetError("certificate " + certificateFile + ": expected a PEM certificate: " + error.message());
  context->use_private_key_file(keyFile, ssl::context::pem, error);
  const bool mismatch =
      error ? ERR_GET_REASON(static_cast<unsigned long>(error.value())) == X509_R_KEY_VALUES_MISMATCH
            : SSL_CTX_check_private_key(context->native_handle()) != 1;
  if (mismatch)
    throw NetError("private key " + keyFile + ": expected the key of certificate " + certificateFile +
                   ", found a different key");
  if (error)
    throw NetError("private key " + keyFile + ": expected a PEM key without a password: " + error.message());
  return context;
}

void checkTlsFiles(const std::string& certificateFile, const std::string& keyFile) {
  loadTls(certificateFile, keyFile);
}

}  // namespace scolopax::net
