function storey
m = [300e3; 250e3];                        % kg, slab and floor
k1 = 1.1e8; c1 = 2*0.02*sqrt(k1*m(2));     % storey
k = 5.4e6; alpha = 48.6e6; n = 2;          % isolator
beta = 0.5/5.5e-3^2; gamma = beta;
record = readmatrix('el_centro_1940.csv'); % s, m/s^2
ground = @(t) interp1(record(:,1), record(:,2), t);

options = odeset('RelTol', 1e-8, 'AbsTol', 1e-10, 'MaxStep', 0.01);
[time, y] = ode45(@rates, record(:,1), zeros(5, 1), options);
base = y(:,1); drift = y(:,2) - y(:,1);
force = k*base + alpha*y(:,5);
plot(time, base)

    function dy = rates(t, y)
        x = y(1:2); v = y(3:4); z = y(5);
        storey = k1*(x(2) - x(1)) + c1*(v(2) - v(1));
        isolator = k*x(1) + alpha*z;
        a = [storey - isolator; -storey]./m - ground(t);
        dz = v(1) - beta*abs(v(1))*abs(z)^(n-1)*z - gamma*v(1)*abs(z)^n;
        dy = [v; a; dz];
    end
end
