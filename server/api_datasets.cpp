// SPDX-License-Identifier: Apache-2.0
// Routes that describe the data sets.
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "server/api.h"

namespace scolopax::server {

std::vector<Route> datasetRoutes(ApiContext& context) {
  using nlohmann::json;
  const auto dataset = [&context](const net::Request& request) {
    auto found = context.datasets.find(request.matches.at(1));
    if (!found)
      throw protocol::ProtocolError(404, "",
                                    "there is no data set " + protocol::shortened(request.matches.at(1)));
    return found;
  };
  const Parameter id{"id", "path", "string", "Id of the data set"};
  const std::vector<std::string> kJson{"application/json"};

  return {
      {"GET",
       "/api/v1/datasets",
       "All data sets: dimensions, spacing, channels",
       {},
       "",
       kJson,
       {},
       [&context](const net::Request&) {
         json list = json::array();
         for (const auto& one : context.datasets.all()) list.push_back(describeJson(*one));
         return jsonResponse(200, {{"datasets", std::move(list)}});
       }},
      {"GET",
       "/api/v1/datasets/{id}",
       "One data set",
       {id},
       "",
       kJson,
       {},
       [dataset](const net::Request& request) { return jsonResponse(200, describeJson(*dataset(request))); }},
      {"GET",
       "/api/v1/datasets/{id}/histogram",
       "Histogram of one channel's values",
       {id, {"channel", "query", "integer", "Index of the channel, from 0 (default)"}},
       "",
       kJson,
       {},
       [dataset](const net::Request& request) {
         return jsonResponse(200,
                             histogramJson(*dataset(request), int(queryUnsigned(request, "channel", 0))));
       }},
      {"GET",
       "/api/v1/datasets/{id}/gradient-histogram",
       "Histogram of the magnitude of one channel's gradient",
       {id,
        {"channel", "query", "integer", "Index of the channel, from 0 (default)"},
        {"joint", "query", "boolean",
         "Whether to return it for every bin of values as well; false if absent"}},
       "",
       kJson,
       {},
       [&context, dataset](const net::Request& request) {
         const auto found = dataset(request);
         const int channel = int(queryUnsigned(request, "channel", 0));
         const bool joint = queryFlag(request, "joint");
         auto gradients = context.datasets.gradients(*found, channel);
         if (!gradients)
           gradients = inLongRequest(context, request, [&](const std::stop_token& stop) {
             return context.datasets.measuredGradients(*found, channel, stop);
           });
         return jsonResponse(200, gradientHistogramJson(*found, channel, *gradients, joint));
       }},
      {"GET",
       "/api/v1/datasets/{id}/probe",
       "The channels' values at a point",
       {id,
        {"x", "query", "number", "World coordinate"},
        {"y", "query", "number", "World coordinate"},
        {"z", "query", "number", "World coordinate"}},
       "",
       kJson,
       {},
       [dataset](const net::Request& request) {
         return jsonResponse(200, probeJson(*dataset(request), queryNumber(request, "x"),
                                            queryNumber(request, "y"), queryNumber(request, "z")));
       }},
  };
}

}  // namespace scolopax::server
