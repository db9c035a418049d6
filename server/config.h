// SPDX-License-Identifier: Apache-2.0
// All settings of the server, with their defaults. Filled in by commands/serve.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

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

  std::size_t maxSessions = 32;
  std::size_t maxClients = 64;                            ///< streams at once
  std::uint64_t maxPixels = 16'777'216;                   ///< of one picture
  std::uint64_t maxMemoryBytes = std::uint64_t{4} << 30;  ///< of memory that requests make the server hold
  double maxRenderSeconds = 60;                           ///< of one POST /render
  int maxRenders = 2;                                     ///< number of POST /render that render at once
  std::size_t maxBodyBytes = std::size_t{1} << 20;
  std::size_t maxMessageBytes = std::size_t{1} << 20;
  std::size_t maxJsonDepth = 32;
  std::chrono::milliseconds keepSession{300'000};
  std::chrono::milliseconds pollTimeout{25'000};
  std::chrono::milliseconds stopGrace{3'000};
};

}  // namespace scolopax::server
