// SPDX-License-Identifier: Apache-2.0
// The server's certificate and key, as Asio wants them.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <string>

namespace scolopax::net {

/// Loads PEM files; null if both names are empty. Throws NetError, which names the faulty file.
std::unique_ptr<boost::asio::ssl::context> loadTls(const std::string& certificateFile,
                                                   const std::string& keyFile);

}  // namespace scolopax::net
