% not run by this project; needs the Model Predictive Control Toolbox
mpc = nlmpc(5, 3, 'MV', 1, 'MD', 2);       % inputs: current, ground
mpc.Ts = 0.02;
mpc.PredictionHorizon = 30;
mpc.ControlHorizon = 30;
mpc.Model.StateFcn = @rates;
mpc.Model.OutputFcn = @(y, u) [y(1); accelerations(y)];
mpc.MV.Min = 0;
mpc.MV.Max = 3;
mpc.Optimization.CustomCostFcn = @cost;    % the sum of squares
mpc.Optimization.CustomIneqConFcn = @slew; % |u - y(5)| <= 30*0.05

% state, last command, and 31 samples of the ground acceleration
command = nlmpcmove(mpc, state, before, [], ground);

function dy = rates(y, u)
    a = accelerations(y) - u(2);
    dy = [y(3:4); a; (u(1) - y(5))/0.05];
end

function a = accelerations(y)
    k1 = 1.1e8; c1 = 2*0.02*sqrt(k1*250e3);
    storey = k1*(y(2) - y(1)) + c1*(y(4) - y(3));
    isolator = (3e6 + 3e6*y(5))*y(1) + (3e5 + 1e5*y(5))*y(3);
    a = [storey - isolator; -storey]./[300e3; 250e3];
end
