/* The arithmetic of sim_backend/physics/batch.py in C: what `push bench physics` measures the compiled batch against. */
#include <math.h>

void run_lanes(const double *lanes, long count, double dt, long steps, long every, double *states, long records,
               double *finals, double *statistics) {
    for (long i = 0; i < count; i++) {
        const double *p = lanes + 14 * i;
        const int round = p[0] != 0.0, open_loop = p[12] != 0.0;  /* of the laws only these two */
        const double reach = p[1], half_width = p[2], d = p[3], mu = p[4];
        const double gain_f = p[8] + 1.0, k_y = p[9], speed = p[10], f_max = p[11];
        double x = 0.0, y = p[5], phi = p[6], s = p[7], fx = 1.0, fy = 0.0, v_x = 1.0, v_y = 0.0;
        const double straight = round ? 0.0 : 1.0, per_length = round ? 1.0 / reach : 0.0;
        const double per_d = 1.0 / d, per_dd = per_d * per_d, jt = -reach, att = 1.0 + jt * jt * per_dd;
        double max_y = 0.0, max_y_c = 0.0, max_theta = 0.0, min_ratio = 1.0;
        long sticking = 0, left = 0, right = 0, step = 0, until_record = 0;
        double *kept = states + 6 * records * i;
        int end = 0;
        for (;;) {
            if (until_record == 0) {
                kept[0] = x, kept[1] = y, kept[2] = phi, kept[3] = s, kept[4] = fx, kept[5] = fy;
                kept += 6;
                until_record = every;
            }
            until_record--;
            const double psi = phi - s * per_length;
            const double n_x = cos(psi), n_y = sin(psi);
            const double jn = -s * straight;
            const double y_c = y + jt * n_y - jn * n_x;
            max_y = fmax(max_y, fabs(y));
            max_y_c = fmax(max_y_c, fabs(y_c));
            if (step == steps) break;
            if (fabs(s) > half_width) {
                end = 1;
                break;
            }
            const double theta_p = open_loop ? 0.0 : gain_f * atan2(v_y, v_x) + k_y * y_c;
            max_theta = fmax(max_theta, fabs(theta_p));
            const double ratio = cos(theta_p - psi);
            min_ratio = fmin(min_ratio, ratio);
            const double v_n = speed * ratio, v_t = speed * sin(theta_p - psi);
            const double ann = 1.0 + jn * jn * per_dd, ant = jn * jt * per_dd;
            const double det = 1.0 + (jn * jn + jt * jt) * per_dd;
            const double stick_t = ann * v_t - ant * v_n, limit = mu * v_n * det;
            const double g_left = ann + mu * ant, g_right = ann - mu * ant;
            double h_n, h_t, slip;
            if (v_n < 0.0) {
                end = 2;
                break;
            }
            if (g_left > 0.0 && stick_t * g_left > limit) {
                h_n = v_n / g_left;
                h_t = mu * h_n;
                slip = v_t - ant * h_n - att * h_t;
            } else if (g_right > 0.0 && -stick_t * g_right > limit) {
                h_n = v_n / g_right;
                h_t = -mu * h_n;
                slip = v_t - ant * h_n - att * h_t;
            } else {
                const double per_det = 1.0 / det;
                h_n = (att * v_n - ant * v_t) * per_det;
                h_t = stick_t * per_det;
                slip = 0.0;
            }
            const double turn = (jn * h_n + jt * h_t) * per_d;
            const double size = sqrt(h_n * h_n + h_t * h_t + turn * turn);
            if (size < 1e-150) {
                end = 2;
                break;
            }
            if (slip == 0.0)
                sticking++;
            else if (slip > 0.0)
                left++;
            else
                right++;
            v_x = h_n * n_x - h_t * n_y, v_y = h_n * n_y + h_t * n_x;
            const double scale = f_max / size;
            fx = v_x * scale, fy = v_y * scale;
            x += v_x * dt, y += v_y * dt, phi += turn * per_d * dt, s += slip * dt;
            step++;
        }
        double *f = finals + 6 * i, *q = statistics + 9 * i;
        f[0] = x, f[1] = y, f[2] = phi, f[3] = s, f[4] = fx, f[5] = fy;
        q[0] = end, q[1] = step, q[2] = max_y, q[3] = max_y_c, q[4] = max_theta, q[5] = min_ratio;
        q[6] = sticking, q[7] = left, q[8] = right;
    }
}
