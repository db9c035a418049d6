// SPDX-License-Identifier: Apache-2.0
// All settings of the server, with their defaults. Filled in by commands/serve.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/json_text.h"

namespace scolopax::server {

struct Config {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;                ///< 0: any free one
  std::string certificateFile, keyFile;     ///< PEM; empty: no TLS
  std::string token;                        ///< empty: a new random one at each start
  int threads = 0;                          ///< for rendering; 0: as many as there are processors
  std::string backend = "cpu";              ///< "cpu" or "cuda", for clients
  std::string webRoot;                      ///< folder of the built page; empty: none
  std::vector<std::string> allowedOrigins;  ///< other than the server's own
  std::vector<std::string> trustedProxies;  ///< as net::Options::trustedProxies

  // The limits of limits.h.
  std::uint64_t maxSessions = 32;
  std::uint64_t maxClients = 64;                          ///< streams at once
  std::uint64_t maxPixels = 16'777'216;                   ///< of one picture
  std::uint64_t maxMemoryBytes = std::uint64_t{4} << 30;  ///< of memory that requests make the server hold
  double maxRenderSeconds = 60;                           ///< of one POST /render or one pick
  std::uint64_t maxRenders = 2;                           ///< number of POST /render that render at once
  std::uint64_t maxBodyBytes = protocol::Limits().bytes;
  std::uint64_t maxMessageBytes = protocol::Limits().bytes;
  std::uint64_t maxJsonDepth = protocol::Limits().depth;

  std::chrono::milliseconds keepSession{300'000};
  std::chrono::milliseconds pollTimeout{25'000};
  std::chrono::milliseconds stopGrace{3'000};
};

}  // namespace scolopax::server
