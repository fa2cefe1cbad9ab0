// Serves turned maximum intensity projections over HTTP, from one plan to many threads:
//
//     build/release/bin/http_tiles ct.nrrd 8080        then http://localhost:8080/30 in a browser
//
// Without a port it serves itself a few pictures and ends.
#include <algorithm>
#include <arpa/inet.h>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <netinet/in.h>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace edgewise;

namespace {

/// A grey picture as a bitmap file, which browsers show.
std::string bitmap(const Data& picture) {
    const Extent& n = picture.what.extent;
    const auto w = static_cast<std::uint32_t>(n.x), h = static_cast<std::uint32_t>(n.y);
    const std::uint32_t row = (3 * w + 3) / 4 * 4;
    std::string file = "BM";
    const auto put = [&](std::uint32_t number, int bytes) {
        for (int i = 0; i < bytes; ++i) file += static_cast<char>(number >> 8 * i & 255);
    };
    put(54 + row * h, 4), put(0, 4), put(54, 4), put(40, 4), put(w, 4), put(h, 4), put(1, 2),
        put(24, 2), put(0, 4), put(row * h, 4);
    file.append(16, '\0');
    const float* first = picture.as<float>();
    const auto [low, high] = std::minmax_element(first, first + picture.what.samples());
    const float scale = 255 / std::max(*high - *low, 1e-30f);
    for (std::uint32_t y = h; y-- > 0;) {  // from below
        for (std::uint32_t x = 0; x < w; ++x)
            file.append(3, static_cast<char>(scale * (first[y * w + x] - *low)));
        file.append(row - 3 * w, '\0');
    }
    return file;
}

/// The picture of a request line such as "GET /30 HTTP/1.1": turned by so many degrees.
std::string answer(const Prepared& plan, const std::string& request) {
    const double degrees = request.size() > 5 ? std::atof(request.c_str() + 5) : 0;
    GeometrySpec views = plan.planned().query.geometry;
    views.steps = {{GeometryStep::Kind::rotate, {0, degrees, 0}}};
    const Prepared turned = plan.with_views(views);
    const std::string body = bitmap(*turned.run({.threads = 1, .keep_frames = true}).frames[0]);
    return "HTTP/1.1 200 OK\r\nContent-Type: image/bmp\r\nContent-Length: " +
           std::to_string(body.size()) + "\r\n\r\n" + body;
}

void serve(const Prepared& plan, std::uint16_t port) {
    const int listening = socket(AF_INET, SOCK_STREAM, 0), yes = 1;
    setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in here{};
    here.sin_family = AF_INET, here.sin_port = htons(port),
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(listening, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0 ||
        listen(listening, 16) != 0)
        return std::perror("port");
    for (;;) {
        const int caller = accept(listening, nullptr, nullptr);
        std::thread([&plan, caller] {
            char request[1024] = {};
            std::string reply = "HTTP/1.1 400 Bad Request\r\n\r\n";
            if (read(caller, request, sizeof request - 1) > 0) try {
                    reply = answer(plan, request);
                } catch (const std::exception& error) {
                    reply += error.what();
                }
            send(caller, reply.data(), reply.size(), MSG_NOSIGNAL);
            close(caller);
        }).detach();
    }
}

}  // namespace

int main(int count, char** words) {
    Query query;
    query.geometry.size = OutputSize{.sides = {256}};
    const Prepared plan = prepare(default_engine(), query,
                                  Volume::read(count > 1 ? words[1] : "phantom:gaussians:48"));
    if (count > 2) serve(plan, static_cast<std::uint16_t>(std::atoi(words[2])));
    std::vector<std::string> replies(8);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < replies.size(); ++i)
        threads.emplace_back([&, i] {
            replies[i] = answer(plan, "GET /" + std::to_string(45 * (i % 4)) + " HTTP/1.1");
        });
    for (std::thread& thread : threads) thread.join();
    for (std::size_t i = 0; i < 4; ++i)
        if (replies[i] != replies[i + 4] || replies[i] == replies[(i + 1) % 4]) return 1;
    return 0;
}
