// rtsp_server PORT USER PASSWORD CERTIFICATE PATH LAUNCH [PATH LAUNCH]...
// A real RTSP server (gst-rtsp-server) on the loopback; PORT 0: any; USER empty: no authentication,
// else digest. CERTIFICATE: PEM file with it and its key, for RTSP over TLS; empty: without TLS. Each PATH serves the GStreamer pipeline LAUNCH. Prints its port when it is ready.
// A program of its own, so that a test can kill it and the sanitizers need not look into GStreamer.

#include <gst/rtsp-server/rtsp-server.h>
#include <sys/prctl.h>

#include <csignal>
#include <cstdio>
#include <string>

int main(int count, char** arguments) {
  if (count < 7) {
    return 2;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // never outlives its test
  gst_init(nullptr, nullptr);
  GstRTSPServer* server = gst_rtsp_server_new();
  gst_rtsp_server_set_address(server, "127.0.0.1");
  gst_rtsp_server_set_service(server, arguments[1]);
  const std::string user = arguments[2];
  const std::string certificate = arguments[4];
  if (!user.empty() || !certificate.empty()) {
    GstRTSPAuth* auth = gst_rtsp_auth_new();
    GstRTSPToken* token =
        gst_rtsp_token_new(GST_RTSP_TOKEN_MEDIA_FACTORY_ROLE, G_TYPE_STRING, "viewer", nullptr);
    if (user.empty()) {
      gst_rtsp_auth_set_default_token(auth, token);
    } else {
      gst_rtsp_auth_set_supported_methods(auth, GST_RTSP_AUTH_DIGEST);
      gst_rtsp_auth_add_digest(auth, user.c_str(), arguments[3], token);
    }
    gst_rtsp_token_unref(token);
    if (!certificate.empty()) {
      GTlsCertificate* pair = g_tls_certificate_new_from_file(certificate.c_str(), nullptr);
      if (pair == nullptr) return 1;
      gst_rtsp_auth_set_tls_certificate(auth, pair);
      g_object_unref(pair);
    }
    gst_rtsp_server_set_auth(server, auth);
    g_object_unref(auth);
  }
  GstRTSPMountPoints* mounts = gst_rtsp_server_get_mount_points(server);
  for (int i = 5; i + 1 < count; i += 2) {
    GstRTSPMediaFactory* factory = gst_rtsp_media_factory_new();
    gst_rtsp_media_factory_set_launch(factory, arguments[i + 1]);
    gst_rtsp_media_factory_set_shared(factory, TRUE);
    gst_rtsp_media_factory_add_role(factory, "viewer", GST_RTSP_PERM_MEDIA_FACTORY_ACCESS,
                                    G_TYPE_BOOLEAN, TRUE, GST_RTSP_PERM_MEDIA_FACTORY_CONSTRUCT,
                                    G_TYPE_BOOLEAN, TRUE, nullptr);
    gst_rtsp_mount_points_add_factory(mounts, arguments[i], factory);
  }
  g_object_unref(mounts);
  if (gst_rtsp_server_attach(server, nullptr) == 0) {
    return 1;
  }
  std::printf("%d\n", gst_rtsp_server_get_bound_port(server));
  std::fflush(stdout);
  g_main_loop_run(g_main_loop_new(nullptr, FALSE));
}
